"""What spins, tumbles and rolls."""
