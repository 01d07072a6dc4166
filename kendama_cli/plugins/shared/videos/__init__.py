"""Video files and images, read and written."""
