"""VDA 5050: position, connection and localization actions for a fleet control, over MQTT."""
