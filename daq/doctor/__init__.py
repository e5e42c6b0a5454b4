"""Is this machine fit for a run, and does this device file suit?"""
