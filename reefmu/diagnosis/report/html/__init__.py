"""report.html.

* `figures`: diagrams as SVG; `elements`: tables, lists and figures; `style`: the style sheet.
* `page`: the page.
"""
