"""From catalogue and surveys to laws: fits, hold-outs, published figures, drawings."""
