"""The torque that a base curve and effects predict over a whole record, with exact sensitivities.

* `base_curve`, `elastic`, `element`: drawing, curve file or power law, and the torque of one element.
* `effect_functions`, `vectorised`, `trajectory`: equations and states of the effects over arrays.
* `parameter_layout`, `predictor`: the vector of all parameters, torque and sensitivities.
"""
