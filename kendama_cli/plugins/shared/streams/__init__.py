"""Poses that programs send over the network: VRPN and OpenIGTLink."""
