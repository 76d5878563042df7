"""The experiments of the thesis and ours, beside those of peers; `python -m studies` lists them."""
