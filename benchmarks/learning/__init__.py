"""Learners beside the search by evidence: cheap draws, features, two learners, and how both are judged."""
