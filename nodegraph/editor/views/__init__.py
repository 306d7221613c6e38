"""Views of the editor: pictures that are turned, cut, measured and compared."""
