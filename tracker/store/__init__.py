"""Tables, history, versions and copies of them."""
