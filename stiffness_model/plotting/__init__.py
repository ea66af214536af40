"""Pictures of results and of drives; matplotlib is loaded when a picture is drawn.

* `style`: colours, lines and axes of all pictures; `curves`: torque, stiffness, forces and load share.
* `profile`: some lobes of the ring gear; `cross_section`: the whole drive to scale, its forces, a turn, the DXF file.
* `drive_tables`: a drive's sizes and parts as tables.
"""
