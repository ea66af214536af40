"""Completion in shells: the words that can follow each other, from the parser, and a script of them for each shell.

words -> scripts
"""
