"""Laws of drives that several analyses share, each stated once (docs/laws.md)."""
