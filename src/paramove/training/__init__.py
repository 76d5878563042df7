"""Movement models trained from demonstration sets, checked by leaving out, drawn, compared and asked."""
