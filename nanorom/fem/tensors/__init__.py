"""Steps III and IV: reaction forces of static load cases, and the tensors they give."""
