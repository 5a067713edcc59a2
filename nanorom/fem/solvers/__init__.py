"""Linear algebra, forms and ranks; `compat` alone knows DOLFINx versions."""
