"""Put the questions, and write down whatever happens."""
