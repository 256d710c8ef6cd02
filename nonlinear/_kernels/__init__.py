"""The compiled side: floats and arrays in, numbers and a status out; it neither raises nor prints."""
