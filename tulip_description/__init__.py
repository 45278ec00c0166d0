"""Robot and field as data, and the models made from them."""
