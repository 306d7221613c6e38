"""The transfer-function editor: histogram, keys, colours, presets."""
