"""Robots behind one small driver protocol, and the ledger that counts their motions."""
