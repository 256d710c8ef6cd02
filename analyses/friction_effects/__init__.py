"""What dry friction does at small signals: threshold, hysteresis, standing error, limit cycles."""
