"""What a diagnosis writes.

* `corrected_model` and `gap`: the model with the effects found, and how far the gap shrank; `location`, `play`: where
  the rest lies, and sizes without a drawing.
* `page`, `figures`, `text`: report.html; `files`: all of it, or nothing.
"""
