"""What a diagnosis writes.

* `corrected_model`, `gap`: the model with the missing effects, and how far it closes the gap; `location`: where a gap
  lies; `play`: clearances without a drawing.
* `summary`, `assemble`: the conclusion in words, and diagnosis.json.
* `rivals`: what a verdict covers, and what else is probable.
* `text`: quantities and cautions in words; `html`: report.html; `files`: all files, or none.
"""
