"""All pictures, reports, films and Rerun recordings. Nothing below this room draws."""
