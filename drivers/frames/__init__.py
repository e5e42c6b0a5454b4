"""What goes over the bus in a cycle: layout of frames, job of a stream, samples, requests, units."""
