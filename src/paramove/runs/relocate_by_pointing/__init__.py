"""A run of relocation by pointing: verdict, report, film; `python -m paramove.runs.relocate_by_pointing`."""
