"""The hand-written C that generated code is measured against."""
