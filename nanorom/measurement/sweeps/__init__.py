"""What plain sweeps and ring-downs tell without a model of the film."""
