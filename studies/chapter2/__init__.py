"""The experiments of thesis chapter 2: HMMs of several kinds trained on a synthetic movement (figures 2.6 to 2.24)."""
