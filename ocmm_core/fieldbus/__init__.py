"""The EtherCAT bus: the device model of the camera, and the master that runs the cameras."""
