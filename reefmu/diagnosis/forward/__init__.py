"""The torque that base curve and effects predict over a whole record, with exact sensitivities.

* `base_curve` and `elastic`: drawing, curve file or power law; `element`: one element's torque.
* `effect_functions`, `vectorised`, `trajectory`: the effects' equations over arrays.
* `parameter_layout`: names to a vector and back; `predictor`: torque and sensitivities.
"""
