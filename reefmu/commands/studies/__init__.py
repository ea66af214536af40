"""Commands that take a design study: `explore`.

* `executors`: the processes or the dask workers that evaluate designs; `study_text`: the results in words and tables.
"""
