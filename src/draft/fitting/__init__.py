"""Fitting of the laws to the catalogue and the survey: fits, hold-outs and figures."""
