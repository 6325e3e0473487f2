"""What all reports are made of: cells, tables, figures, pages and documents."""
