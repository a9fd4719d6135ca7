"""The report on paper: PDF with symbols, plots and a picture, all drawn as paths."""
