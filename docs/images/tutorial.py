"""Pictures of the tutorial on motion capture, made by its commands.

python docs/images/tutorial.py
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

HERE = Path(__file__).parent
QUALITY = 74
WIDTH_PX = 1200
COMMANDS = (
    "demos synthesize sets/table --columns 3 --rows 3 --repetitions 5",
    "demos split sets/table --by theta --fraction 0.25 --seed 6",
    "train sets/table_train --leave-out none",
    "models plot models/reaching.npz --output model.png",
    "recognize sets/table_test --model models/reaching.npz --plot recognised.png",
    "synthesize models/reaching.npz --theta 0.15,-0.40 --out made.csv --plot made.png",
)


def main() -> None:
    """Run the commands in an empty folder and bring the pictures here."""
    with tempfile.TemporaryDirectory() as folder:
        for command in COMMANDS:
            subprocess.run([sys.executable, "-m", "paramove.cli.main", *command.split()], cwd=folder, check=True)
        for name in ("model.png", "recognised.png", "made.png"):
            with Image.open(Path(folder) / name) as picture:
                height = round(picture.height * WIDTH_PX / picture.width)
                smaller = picture.convert("RGB").resize((WIDTH_PX, height), Image.Resampling.LANCZOS)
                smaller.save(HERE / Path(name).with_suffix(".jpg"), quality=QUALITY, optimize=True)


if __name__ == "__main__":
    main()
