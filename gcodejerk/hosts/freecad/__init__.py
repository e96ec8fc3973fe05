"""What is installed into FreeCAD: a post-processor that posts with a stock one, then rewrites."""
