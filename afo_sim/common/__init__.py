"""Ground floor: units, errors, files. No physics, no MuJoCo."""
