"""report.html.

* `figures`: diagrams as SVG; `elements`: tables, lists and figures; `style`: the style sheet.
* `probabilities`: the part of the page on hypotheses; `page`: the page.
"""
