"""Loci of special points, and backbones."""
