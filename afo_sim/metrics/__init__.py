"""Numbers from columns: definitions, strides, walking. Columns are dictionaries of arrays."""
