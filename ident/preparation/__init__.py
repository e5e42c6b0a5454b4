"""From samples to rows: checks, filters, noise, decimation."""
