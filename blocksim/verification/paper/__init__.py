"""The paper's figures, tables and equations with the results of the shipped scenarios."""
