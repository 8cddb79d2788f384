"""Every published number held against simulation."""
