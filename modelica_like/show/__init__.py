"""What people see: plots, schematics, tables, reports, pages in a browser."""
