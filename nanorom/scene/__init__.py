"""What is known of a device and what is asked about it: data only."""
