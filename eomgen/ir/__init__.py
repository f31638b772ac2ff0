"""The intermediate representation: expressions, equations of motion and programs."""
