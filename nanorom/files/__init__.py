"""Files that know no content: whole or not at all, read without trust."""
