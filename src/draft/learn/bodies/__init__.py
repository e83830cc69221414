"""Bodies that a policy is trained with: designs and their numbers."""
