"""The linear writing of a drive (model.md section 8), of one design or of many: numbers or arrays (K,)."""
