"""A run of the pointing application: verdict, report, film; `python -m paramove.runs.pointing`."""
