"""A run of the rule-learning demonstration: verdict, report, film; `python -m paramove.runs.rule_learning`."""
