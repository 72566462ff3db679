"""The paper's figures, tables and equations beside what the shipped scenarios give."""
