"""Pictures and reports made from the model: plans, views."""
