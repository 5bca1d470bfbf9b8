// goburrow/modbus as the master of unit 1, on 127.0.0.1:PORT or on a serial line: `modbus PORT` or `modbus DEVICE`. Prints a line a
// service.
package main

import (
	"encoding/binary"
	"errors"
	"fmt"
	"log"
	"os"
	"strconv"
	"time"

	"github.com/goburrow/modbus"
)

const (
	controlword     = 0x0000
	mode            = 0x0001
	targetVelocity  = 0x0004
	statusword      = 0x0100
	profileVelocity = 0x0200
	nothing         = 0x4000
	bitRate         = 19200
	patience        = time.Minute
)

// words gives the registers of an answer; an error ends the program.
func words(data []byte, err error) []uint16 {
	if err != nil {
		log.Fatal(err)
	}
	found := make([]uint16, len(data)/2)
	for place := range found {
		found[place] = binary.BigEndian.Uint16(data[2*place:])
	}
	return found
}

func reach(drive modbus.Client, command uint16, state uint16) {
	words(drive.WriteSingleRegister(controlword, command))
	begin := time.Now()
	for words(drive.ReadHoldingRegisters(statusword, 1))[0]&0x6F != state {
		if time.Since(begin) > patience {
			log.Fatalf("no state %#x", state)
		}
	}
}

// line gives the way to unit 1; it connects at the first request.
func line(place string) modbus.ClientHandler {
	if _, err := strconv.Atoi(place); err == nil {
		tcp := modbus.NewTCPClientHandler("127.0.0.1:" + place)
		tcp.SlaveId = 1
		tcp.Timeout = patience
		return tcp
	}
	serial := modbus.NewRTUClientHandler(place)
	serial.SlaveId = 1
	serial.Timeout = patience
	serial.BaudRate = bitRate
	serial.Parity = "N"
	return serial
}

func main() {
	drive := modbus.NewClient(line(os.Args[1]))

	words(drive.WriteMultipleRegisters(profileVelocity, 2, []byte{0, 1, 0xE2, 0x40}))
	fmt.Println("16, 3:", words(drive.ReadHoldingRegisters(profileVelocity, 2)))
	fmt.Println("4:", words(drive.ReadInputRegisters(profileVelocity, 2)))
	words(drive.WriteSingleRegister(mode, 3))
	fmt.Println("6:", words(drive.ReadHoldingRegisters(mode, 1)))
	fmt.Println("23:", words(drive.ReadWriteMultipleRegisters(mode, 1, targetVelocity, 2, make([]byte, 4))))
	_, err := drive.ReadHoldingRegisters(nothing, 1)
	var refused *modbus.ModbusError
	if !errors.As(err, &refused) {
		log.Fatal(err)
	}
	fmt.Println("exception:", refused.ExceptionCode)
	for _, step := range [][2]uint16{{0x06, 0x21}, {0x07, 0x23}, {0x0F, 0x27}} {
		reach(drive, step[0], step[1])
	}
	fmt.Println("enabled")
	reach(drive, 0x00, 0x40)
	fmt.Println("disabled")
}
