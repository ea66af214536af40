"""What an FMU says about itself: the folder `documentation` and the icon.

    web_assembly, curve_picture -> drive_page -> members

* `web_assembly`: the model compiled for the page; `curve_picture`: torque and stiffness over twist as SVG.
* `drive_page`: the page, which runs the drive where there is a compiler; `members`: all files of the folder.
"""
