"""What drives, on tyres or wheels."""
