"""The drive itself, drawn to scale.

* `layout`: where every part stands at a crank angle; `element_forces`: the contact forces there.
* `outline`: the gear's profile as a polygon; `row_outlines`: the outlines of one row's parts.
* `row`: one row on given axes; `drive_figures`: whole figures; `animation`: a turn of the crank as a GIF.
* `dxf`: the profile for the workshop.
"""
