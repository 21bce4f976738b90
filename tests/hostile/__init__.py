"""What tests/hostile.py is made of: files that are made, what they are run by, and how the answers are judged."""
