"""report.html.

* `svg_figure`: a figure as SVG; `figures`: those of a diagnosis; `elements`: tables, lists, commands, losses;
  `meanings`: what quantities are, in words; `style`, `script`: of the page.
* `origin`: command, version, date and files; `next_commands`: what to do next, as commands.
* `probability_overview`: the part of the page on hypotheses; `page`: the page.
"""
