"""Stands here so that tests in all folders can import the helpers of this one: ``from buildings import building``."""
