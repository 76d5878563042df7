"""`python -m studies NAME`, from the root of a clone."""

from __future__ import annotations

import typer

from studies.chapter2.command import chapter2
from studies.chapter4.command import chapter4
from studies.chapter6.command import chapter6
from studies.faults.command import faults, kills
from studies.imitation.command import imitation
from studies.movements.command import peers, real
from studies.multicam.command import multicam
from studies.real_images.command import real_images
from studies.teaching.command import teaching

app = typer.Typer(name="studies", help="Repeat the experiments of the thesis, and ours.", no_args_is_help=True)
app.command("kills")(kills)
app.command("faults")(faults)
app.command("imitation")(imitation)
app.command("real")(real)
app.command("peers")(peers)
app.command("chapter2")(chapter2)
app.command("chapter4")(chapter4)
app.command("chapter6")(chapter6)
app.command("real-images")(real_images)
app.command()(multicam)
app.command()(teaching)

if __name__ == "__main__":
    app(prog_name="python -m studies")
