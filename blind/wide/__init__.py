"""A generator wider than reality: draws machines, drives and sensors by laws of its own and writes what they would record."""
