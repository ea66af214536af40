"""Commands that write or read an FMU: `export`, `check`.

* `effect_values`: effects and their values from the words of `--effect`.
* `coupling_step`: whether a communication step is short enough for the masses around the drive.
"""
