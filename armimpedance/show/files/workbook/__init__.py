"""The Excel workbook: sheets, their looks, cells that stay what they are, the same bytes always."""
