"""LinuxCNC: HAL files, a user M code and lines of an INI, for the forms of `linuxcnc-hal`."""
